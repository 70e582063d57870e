// What lcm-spy's type database finds on the class path: java -cp lcm.jar:types.jar SpyTypes.java NAME...
// Prints the number of the named types of package seastitch that it knows by their fingerprints.
public class SpyTypes {
  public static void main(String[] names) throws Exception {
    lcm.spy.LCMTypeDatabase database = new lcm.spy.LCMTypeDatabase();
    int found = 0;
    for (String name : names) {
      Class<?> type = Class.forName("seastitch." + name);
      long fingerprint = type.getField("LCM_FINGERPRINT").getLong(null);
      if (type.equals(database.getClassByFingerprint(fingerprint))) ++found;
    }
    System.out.println("found " + found);
  }
}
